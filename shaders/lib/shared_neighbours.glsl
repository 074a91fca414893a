#include "lib/shared_shadows.glsl"
#include "lib/shared_seen.glsl"

uniform usampler2D shared_shadows; // of the pixels of the class, by their cells: shared_shadows.frag

const float ON_PLANE = 0.02;       // squared sine of what a neighbour may lie off a surface's plane, as bends have it
const float FAR = 2e-3;            // of its distance over that of pixels beside each other, squared: it may lie behind a silhouette
const float AS_GOOD = 0.05;        // of two neighbours, between which edges of shadows are then blurred

// The means of four bits each.
uvec2 mean_of(uvec2 one, uvec2 other) {
    return (one & other) + (((one ^ other) & 0xeeeeeeeeu) >> 1u);
}

// What two neighbours of the class have looked up on the same surface, or the one that lies least beside it.
void see_shared(ivec2 pixel, vec3 position, vec3 normal) {
    int first = SHARED_STEPS * ((shared_class - class_of(pixel)) & (SHARED_CLASSES - 1));
    ivec2 chosen = pixel, other = pixel, last = ivec2(view.size) - 1;
    float least = 1.0e38, second = 1.0e38;
#ifdef ORTHOGRAPHIC
    float beside = dot(view.right, view.right);
#else
    vec3 away = position - view.relative_from_camera[3].xyz;
    float beside = dot(view.right, view.right) * dot(away, away);
#endif
    for (int i = 0; i < SHARED_STEPS; ++i) {
        ivec2 to = steps_to_class[first + i], at = pixel + to;
        float stored = texelFetch(plane_depth, clamp(at, ivec2(0), last), 0).x;
        vec3 step = position_at(vec2(at) + 0.5, camera_depth(stored)) - position;
        float off = dot(normal, step), far = dot(step, step), pixels = float(to.x * to.x + to.y * to.y);
        float apart = max(off * off / max(far, 1e-30), ON_PLANE) + FAR * far / (beside * max(pixels, 1.0)) + 1e-3 * float(i);
        bool is_there = all(equal(at, clamp(at, ivec2(0), last))) && stored != BACKGROUND_DEPTH;
        if (!is_there || apart >= second) continue;
        bool is_least = apart < least;
        second = is_least ? least : apart;
        other = is_least ? chosen : at;
        least = is_least ? apart : least;
        chosen = is_least ? at : chosen;
    }
    if (chosen == pixel || second > least + AS_GOOD) other = chosen;
    uvec2 one = texelFetch(shared_shadows, cell_of_pixel(chosen), 0).xy;
    uvec2 two = texelFetch(shared_shadows, cell_of_pixel(other), 0).xy;
    shared_seen = least < 1.0e38 ? mean_of(one, two) : uvec2(0xffffffffu);
}
