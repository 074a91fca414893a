"""NurbsPatches and their trim curves."""
