"""Label Studio's JSON for video."""
