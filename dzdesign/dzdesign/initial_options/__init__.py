"""What `dzdesign init` proposes: recordings are looked at, and the options file is written with reasons."""
