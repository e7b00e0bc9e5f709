"""The current controller in C against exact numbers: state by state, and in a loop with a coil."""
