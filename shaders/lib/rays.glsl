// Does a ray meet a triangle? By boxes in a complete binary tree (scene/triangle_tree.py): node i has the children 2i and 2i + 1,
// so the next node of a walk is its own number plus one, less its trailing zeros.
layout(std430, binding = 9) readonly buffer BoxBlock { uvec4 tree_boxes[]; };    // of each axis the least in the lower half
layout(std430, binding = 10) readonly buffer TriangleBlock { vec4 tree_triangles[]; };

uniform uvec2 tree_shape;          // leaves, and triangles of each
uniform vec3 tree_from_relative;   // what takes a relative position to where triangles are counted from
uniform vec3 grid_low, grid_step;  // in which boxes are counted, from there

// Möller & Trumbore 1997, "Fast, Minimum Storage Ray/Triangle Intersection".
bool meets_triangle(vec3 origin, vec3 direction, float reach, uint triangle) {
    vec3 along = tree_triangles[3u * triangle + 1u].xyz, aside = tree_triangles[3u * triangle + 2u].xyz;
    vec3 p = cross(direction, aside);
    float scale = 1.0 / dot(along, p);
    vec3 s = origin - tree_triangles[3u * triangle].xyz;
    vec3 q = cross(s, along);
    float u = dot(s, p) * scale, v = dot(direction, q) * scale, t = dot(aside, q) * scale;
    return u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && t < reach;
}

bool meets_leaf(vec3 origin, vec3 direction, float reach, uint leaf) {
    uint first = leaf * tree_shape.y;
    for (uint i = first; i < first + tree_shape.y; ++i)
        if (meets_triangle(origin, direction, reach, i)) return true;
    return false;
}

// A ray from a relative position, as far as `reach`.
bool meets_anything(vec3 position, vec3 direction, float reach) {
    vec3 origin = position + tree_from_relative;
    vec3 scale = grid_step / mix(direction, vec3(1e-20), lessThan(abs(direction), vec3(1e-20)));
    vec3 at = (origin - grid_low) / grid_step;
    uint node = 1u;
    do {
        uvec3 box = tree_boxes[node].xyz;
        vec3 a = (vec3(box & 0xffffu) - at) * scale, b = (vec3(box >> 16u) - at) * scale;
        vec3 near = min(a, b), far = max(a, b);
        bool inside = min(min(min(far.x, far.y), far.z), reach) >= max(max(max(near.x, near.y), near.z), 0.0);
        if (inside && node < tree_shape.x) {
            node *= 2u;
            continue;
        }
        if (inside && meets_leaf(origin, direction, reach, node - tree_shape.x)) return true;
        ++node;
        node >>= findLSB(node);
    } while (node != 1u);
    return false;
}
