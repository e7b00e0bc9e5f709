"""Proposal of `dzdesign init`: recordings enter, the text of an options file leaves, every line with its reason."""
