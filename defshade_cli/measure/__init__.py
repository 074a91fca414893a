"""How far from the truth, how long for it, and what breaks: nothing that a render needs.

reference, brdf, light, area, albedo, axes   the lighting in float64, and its closed forms
pathtraced…, mitsuba_plugins                 the same scenes in Mitsuba        luxtest   and in Arnold's test suite
accuracy…, convergence, error, furnace       errors against these, as tables and plots
bench/         run time against error        layouts, llvm   what they are measured on
conformance/   stages and pictures by others gallery         our own
stress/, fuzz/ corners of the arithmetic, and damaged files
"""
