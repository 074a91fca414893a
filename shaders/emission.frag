#include "lib/view.glsl"
#include "lib/surface.glsl"
#include "generated/planes.glsl"

out vec4 radiance;

// What the light volumes add to: emitted radiance, and coverage in alpha.
void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    bool covered = texelFetch(plane_depth, pixel, 0).x != BACKGROUND_DEPTH;
    radiance = vec4(0.0, 0.0, 0.0, covered ? 1.0 : 0.0);
#ifdef PLANE_EMISSION
    if (covered) radiance.rgb = view.exposure * read_planes(pixel).emission;
#ifdef PLANE_WEIGHTS
    if (covered) radiance.rgb *= read_planes(pixel).weights.y;
#endif
#endif
}
