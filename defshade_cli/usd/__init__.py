"""The only package that speaks USD: Usd.Stage → Scene, frame by frame.

    opening/           a file → an open stage         render_settings/   what it asks for, and as what
    reader             the frames of one product      traversal          the walk over its prims: kind, said, identity
                                                      pieces             what each of them is
    memory, sharing    what stays from frame to frame, materials/materials of it                names   of prims

What prims are read as:

    surfaces/          any of them, and how finely    polygons/, subdivision/   meshes, and their limit
    gprims/, curves/, nurbs/, models/                 other shapes, and stand-ins for models
    skel/              bent by skeletons              instancing/        placed N times
    materials/         what they are made of          lights/            what lights them
    camera, sight      who looks                      facing             what turns to it
    drawables, palette all of it as one Scene

    values, color_space, xform   attributes as arrays      blame              why something failed
"""
