"""The arithmetic in its corners: generated stages, each rendered and held against the float64 reference.

stage      a small stage whose parts can be replaced       corners    the stages, family by family
verdict    what a corner came to, and the table
"""
