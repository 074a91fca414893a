"""The deferred renderer: (Plan, Scene) → Film.

gbuffer       opaque geometry into the planes of the table in planes.py
lighting      each light as its volume, blended over what the GBuffer says
accumulation  samples summed in float32
readback      planes and sums as named layers in NumPy
pipeline      the order of the passes; local variables are the edges
"""
