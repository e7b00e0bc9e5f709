"""Binary tables: files of programs enter, their columns leave; one module of `formats` a format, read by a process."""
