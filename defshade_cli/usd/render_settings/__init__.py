"""What the RenderSettings, products and passes of a stage ask for."""
