"""An output that is no C firmware, in; what its manifest says, and what the room of its kind found, out."""
