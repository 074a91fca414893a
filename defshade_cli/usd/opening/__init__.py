"""A file becomes an open stage: what is laid over it, chosen of it, left out, and what of it is missing."""
