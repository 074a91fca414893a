"""The only package that speaks moderngl and OpenGL.

    context    a headless GL 4.5 context and the few entry points moderngl lacks
    shaders    GLSL files → programs: includes, defines, errors as file:line
    records    GLSL structs → NumPy dtypes
    planes     the table of GBuffer planes → GLSL on both sides
    targets    textures and framebuffers that passes draw into
    textures   a Scene's textures in texture arrays
    vertices   meshes as vertex arrays
    residence  a Scene's arrays in GPU buffers

Everything a Gpu makes lives on its ExitStack and is released with it; passes free nothing.
"""
