"""UsdLux lights, those made of geometry, their files, and what each of them lights."""
