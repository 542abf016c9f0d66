"""Read what Rerun has made of an MCAP, and print it as JSON; runs where rerun-sdk is installed.

python read_rrd.py FILE.rrd
"""

import hashlib
import json
import sys

from rerun.chunk import RrdReader

components = {}
for chunk in RrdReader(sys.argv[1]).stream().to_chunks():
    batch = chunk.to_record_batch()
    if "message_log_time" not in batch.schema.names:
        continue
    times = [int(time.value) for time in batch.column("message_log_time")]
    for name in batch.schema.names:
        key = f"{chunk.entity_path}:{name}"
        values = batch.column(name).to_pylist()
        if name == "VideoStream:sample":
            values = [hashlib.sha256(bytes(sample)).hexdigest() for (sample,) in values]
        elif name != "VideoStream:codec":
            values = [None] * len(values)
        found = components.setdefault(key, [])
        found.extend(zip(times, values, strict=True))
json.dump({key: sorted(found, key=str) for key, found in components.items()}, sys.stdout)
