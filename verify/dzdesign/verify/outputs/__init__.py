"""An output other than a C firmware, in; what its manifest says, and what the room of its kind found, out."""
