"""One module per command: parsed options enter, files and printed results leave."""
