"""The deferred renderer: (Plan, Scene) → Film.

    pipeline          a frame: the order of the passes; local variables are the edges
    sampler           its samples, until they are enough
    sample_lighting   all light of one of them
    frame, screen     the targets of a frame, and which part of it is drawn
    last_frame, changed…   what the frame before leaves of it

A sample:

    sampling, filters, view          where it lies in its pixel, on the lens and in time
    geometry, gbuffer, culling       opaque geometry into the planes of gpu/planes.py
    emitters, shadow…, shadows       what stands for each light in it, and the maps seen from there
    emission, lighting, volumes      what shines by itself; each light as its volume
    light_tiles, light_lists, hidden_lights   many lights, by tiles of the image
    light_whole, shared_shadows      lights that reach all of it; a dome's shadows, looked up by pixels for each other
    environment, dome…, sky…         skies, and how much of them is open
    lobes, lobe_rays, lamp_records   what lobes mirror, by rays of each pixel's own
    light_records, light_traits, light_targets, linking, tables   what the shaders read of lights, and draw them into

All of them:

    accumulation, batch_means, convergence, stopping   summed in float32, and whether they are enough
    readback, identification, motion                   planes and sums as named layers in NumPy
    display, debug_volumes                             what a display shows; the volumes themselves
"""
