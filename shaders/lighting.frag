#include "lib/shading.glsl"
#include "generated/outputs.glsl"

flat in Light light;

// One light on what its volume covers.
void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float stored = texelFetch(plane_depth, pixel, 0).x;
    vec3 position = position_at(gl_FragCoord.xy, camera_depth(stored));
    Surface surface = read_planes(pixel);
    see_footprint(surface, pixel);
    if (stored == BACKGROUND_DEPTH) discard;
    vec3 l;
    vec3 irradiance = irradiance_from(light, position, l);
    if (irradiance == vec3(0.0) || !is_lit_by(light, surface)) {
        write_nothing();
        return;
    }
    write_light(exposed(lit_by(light, l, irradiance, surface, position, direction_to_eye(position))));
}
