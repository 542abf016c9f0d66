"""Labels in and labels out: one file a format."""
