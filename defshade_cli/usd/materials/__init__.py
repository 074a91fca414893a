"""UsdShade materials with their networks and textures, MaterialX in their terms, and which is bound where."""
