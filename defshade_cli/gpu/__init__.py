"""The only package that speaks moderngl and OpenGL.

    context    a headless GL 4.5 context and the few entry points moderngl lacks
    shaders    GLSL files → programs: includes, defines, errors as file:line
    records    GLSL structs → NumPy dtypes
    planes     the table of GBuffer planes → GLSL on both sides
    targets    textures and framebuffers that passes draw into
    textures   a Scene's textures in texture arrays
    buffers    where shaders find records, and the buffers that hold them
    vertices, vertex_pool   meshes as vertex arrays, and those in buffers
    scene_records           placements and materials as records
    draw_list               what is drawn of them
    residence               a Scene in all of these

Everything a Gpu makes lives on its ExitStack and is released with it; passes free nothing.
"""
