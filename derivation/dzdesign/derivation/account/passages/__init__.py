"""The numbers that the paper prints, against digests of the passages that they stand in."""
