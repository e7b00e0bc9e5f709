"""Programs that dzdesign starts and waits for: a command in, its exit status and what it wrote out."""
