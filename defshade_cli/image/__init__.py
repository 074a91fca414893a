"""The only package that speaks OpenImageIO and OpenColorIO: films, files, layers and colour.

    film            a frame in memory          layers/     the table of what it may hold
    files           film → files               encoders/   what each format holds of a film
    appearing       whole files or none        verification, metadata, sizes   read back, headers, small copies
    reading, stored files → layers             compare, perception, soundness  how far apart, and whether numbers at all

Colour:

    colour          scene-linear → a display   display_shader, display_table   the same for a graphics device
    ocio, kept      configs, and what is kept of their answers                 render_space, transfer   what light is in
    look, false_colour, sheet, thumbnail       layers for eyes
    viewer, page, terminal, inline, snapshot   pages and terminals that show them

Images that a stage brings:

    texture         files → texels             reduction, whiteness   smaller, and whether any texel is below 1
    environment, projections, light_texture    skies and images that shine        cryptomatte   names as ids
"""
