"""One module a command: parsed options enter, files and printed results leave."""
