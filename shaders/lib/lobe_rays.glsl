// Rays along a surface's lobes, and how dense they are.

// Of the coat's lobe among rays, by what both lobes reflect.
float coat_rays(Surface s, float NoV) {
#ifdef PLANE_CLEARCOAT
    vec3 base = E_bound(s.f0, s.f90, NoV, GGX_alpha(s.roughness), SMITH_GGX);
    float coat = s.clearcoat * E_bound(vec3(DEFAULT_F0), vec3(1.0), NoV, GGX_alpha(s.clearcoat_roughness), SMITH_GGX).x;
    return coat / max(coat + (base.x + base.y + base.z) / 3.0, 1e-6);
#else
    return 0.0;
#endif
}

// Of a pixel's samples, the share that sends rays: wide lobes find lights by the points and directions that pixels share.
float ray_share(Surface s, vec3 v) {
    if (dot(s.normal, v) < MIN_NOV) return 0.0;
    return 1.0 - smoothstep(5.0 / 7.0 * view.roughest_rays, view.roughest_rays, sharpest_roughness(s));
}

// Heitz 2018, "Sampling the GGX Distribution of Visible Normals", eq. 17: G1 D / (4 NoV) by solid angle of the light.
float visible_normals_density(float alpha, float NoV, float NoH, vec3 n, vec3 h) {
    float a2 = alpha * alpha;
    return 0.5 * D_GGX(alpha, NoH, n, h) / (NoV + sqrt(a2 + (1.0 - a2) * NoV * NoV));
}

// Of rays along `l`, by solid angle.
float ray_density(Surface s, vec3 v, vec3 l) {
    vec3 h = normalize(v + l);
    float NoV = dot(s.normal, v), NoH = dot(s.normal, h);
    float density = visible_normals_density(GGX_alpha(s.roughness), NoV, NoH, s.normal, h);
#ifdef PLANE_CLEARCOAT
    float coat = visible_normals_density(GGX_alpha(s.clearcoat_roughness), NoV, NoH, s.normal, h);
    density = mix(density, coat, coat_rays(s, NoV));
#endif
    return density;
}

// What rays bear of a light in lobes, where `denser` times as many of them find it as of the points or directions that all
// pixels share, which bear the rest. Veach & Guibas 1995, "Optimally Combining Sampling Techniques for Monte Carlo Rendering",
// the power heuristic.
float share_of_rays(float denser) {
    return 1.0 - 1.0 / (1.0 + denser * denser);
}

// The rest, of a point or a direction that stands for a solid angle.
float share_beside_rays(Surface s, vec3 v, vec3 l, float solid_angle) {
    float share = ray_share(s, v);
    return share > 0.0 ? 1.0 - share_of_rays(solid_angle * view.lobe_rays * share * ray_density(s, v, l)) : 1.0;
}
