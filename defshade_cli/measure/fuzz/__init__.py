"""Input that lies: seeded mutations of this project's stages and of what they refer to, each in a contained process.

mutations   one lie in a file's bytes       corpus   the stages, what they depend on, and a case for each number
campaign    cases rendered one after another by a warm worker, and what became of them
"""
