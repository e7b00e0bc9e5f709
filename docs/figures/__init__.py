"""The figures of the pages: drawn by the product from its bundled example, never committed."""
