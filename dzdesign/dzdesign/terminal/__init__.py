"""The terminal and the notebook: results enter, tables, progress and summaries leave."""
