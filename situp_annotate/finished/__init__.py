"""What is made of a finished run, without tracking: new drawings, fewer keyframes, corrections."""
