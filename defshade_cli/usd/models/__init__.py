"""Models drawn as boxes, axes or cards in their place."""
