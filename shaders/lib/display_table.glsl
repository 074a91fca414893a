// Of defshade_cli/image/display_table.py.
layout(binding = 1, rgba32f) readonly restrict uniform image3D table; // alpha: is the cell from there on too coarse?
const float TABLE_SCALE = float(TABLE_CELLS) / log2(1.0 + TABLE_MOST / TABLE_TOE);

// Linear in the cell's tetrahedron: from its first corner along the axes in the order of how far `color` lies along them.
// Near where the transform itself is wanted.
vec4 display(vec4 color) {
    vec3 at = log2(1.0 + max(color.rgb, 0.0) / TABLE_TOE) * TABLE_SCALE;
    bool outside = any(lessThan(color.rgb, vec3(0.0))) || any(greaterThanEqual(at, vec3(TABLE_CELLS)));
    ivec3 cell = min(ivec3(at), TABLE_CELLS - 1);
    vec3 within = at - vec3(cell);
    bvec3 passes = greaterThanEqual(within, within.yzx);    // red green, green blue, blue red
    bvec3 largest = bvec3(passes.x && !passes.z, passes.y && !passes.x, passes.z && !passes.y);
    bvec3 beyond_least = bvec3(passes.x || !passes.z, passes.y || !passes.x, passes.z || !passes.y);
    float most = max(within.r, max(within.g, within.b)), least = min(within.r, min(within.g, within.b));
    float middle = within.r + within.g + within.b - most - least;
    vec4 first = imageLoad(table, cell);
    gl_FragDepth = outside || first.a > 0.0 ? 0.0 : 1.0;
    return (1.0 - most) * first + (most - middle) * imageLoad(table, cell + ivec3(largest))
        + (middle - least) * imageLoad(table, cell + ivec3(beyond_least)) + least * imageLoad(table, cell + 1);
}
