"""Text tables: bytes of a delimited file enter, its columns leave: encoding, header, cells, decimal mark, footer."""
