"""One frame of a stage as frozen dataclasses of NumPy arrays: the language of what reads it and what draws it.

    scene      all of a frame                  camera, window, view, framing   who looks, at what part, how large it is
    geometry   meshes and where they stand     material, texture               what they are made of
    light, shaping   every kind of light       shadow, linking, studio         how it falls, on what, and one of our own
    identity   what stands behind each thing   motion   where it was           product, extras   what the stage asks for

Light is looked up and sampled by

    emission, distribution   the points of a light in one sample
    environment, radiance_map, mesh_light, ies   skies, images, meshes and profiles that shine
    lamp, triangle_tree      shapes and triangles as a ray meets them
    closed                   meshes that light leaves as it enters them

and `arrays` checks what all of them hold.
"""
