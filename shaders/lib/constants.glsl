const float PI = 3.14159265358979;

// Roughness 0 is a delta that no point light can light; it is defined as roughness 0.01.
const float MIN_ALPHA = 1e-4;

// Grazing views: keeps the visibility term finite where interpolated normals turn away.
const float MIN_NOV = 1e-4;
