#include "lib/light_sum.glsl"
#include "generated/outputs.glsl"
#ifdef SHARED_SHADOWS
#include "lib/shared_neighbours.glsl"
#endif
#include "generated/lights.glsl"

// Every light on every pixel that shows a surface: the others fail the depth test.
void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec3 position = position_at(gl_FragCoord.xy, camera_depth(texelFetch(plane_depth, pixel, 0).x));
    Surface surface = read_planes(pixel);
    see_footprint(surface, pixel);
#ifdef SHARED_SHADOWS
    see_shared(pixel, position, surface.normal);
#endif
    Lit total = no_light(0u);
    add_lights(total, surface, position, direction_to_eye(position));
    write_light(exposed(total));
}
