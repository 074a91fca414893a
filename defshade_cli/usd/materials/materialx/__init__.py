"""MaterialX, read into the terms of UsdPreviewSurface.

.mtlx file ── documents ──→ Sdf layer ──┐
shaders authored in USD ────────────────┴─ nodes, coordinates ──→ Signal ── surfaces ──→ fields and textures

A document becomes the prims that OpenUSD's own plugin would make of it, so that what follows knows one form. Every
input of a surface becomes a Signal, a constant or a texel scaled and shifted; what is neither is named as lost.
"""
