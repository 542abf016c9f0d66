"""Labels drawn on pictures: overlay videos, contact sheets, animated excerpts."""
