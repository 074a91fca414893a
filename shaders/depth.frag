// Depth alone is written.
void main() {}
