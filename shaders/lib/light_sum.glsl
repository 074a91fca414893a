#include "lib/shading.glsl"

// One light more on a pixel. What is out of a light's reach gets nothing of it, which is as dear as a branch around the rest.
void add_light(inout Lit total, Light light, Surface surface, vec3 position, vec3 v) {
    if (!is_lit_by(light, surface)) return;
    vec3 l;
    vec3 irradiance = irradiance_from(light, position, l);
    Lit lit = lit_by(light, l, irradiance, surface, position, v);
    total.radiance += lit.radiance;
    total.diffuse += lit.diffuse;
    total.sent += lit.sent;
    total.arrived += lit.arrived;
}

Lit no_light(uint count) {
    return Lit(vec3(0.0), vec3(0.0), 0.0, 0.0, float(count));
}
