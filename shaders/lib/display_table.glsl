// Of defshade_cli/image/display_table.py.
uniform sampler3D table;           // alpha: is the cell from there on too coarse?
const float TABLE_SCALE = float(TABLE_CELLS) / log2(1.0 + TABLE_MOST / TABLE_TOE);

// Near where the transform itself is wanted.
vec4 display(vec4 color) {
    vec3 at = log2(1.0 + max(color.rgb, 0.0) / TABLE_TOE) * TABLE_SCALE;
    bool outside = any(lessThan(color.rgb, vec3(0.0))) || any(greaterThanEqual(at, vec3(TABLE_CELLS)));
    bool coarse = texelFetch(table, min(ivec3(at), TABLE_CELLS - 1), 0).a > 0.0;
    gl_FragDepth = outside || coarse ? 0.0 : 1.0;
    return textureLod(table, (at + 0.5) / float(TABLE_CELLS + 1), 0.0);
}
