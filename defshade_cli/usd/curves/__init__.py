"""Curves of all bases, as tubes, ribbons and lines."""
