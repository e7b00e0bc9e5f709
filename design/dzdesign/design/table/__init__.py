"""Table of beta: an exact ceiling of the offset in, the nodes that are worth most under it out."""
