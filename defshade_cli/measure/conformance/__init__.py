"""Stages by others, rendered beside the reference images that came with them.

catalogue    the ITEM.json files of the assets folder → Cases: a stage, a reference and the conditions it was made under
conditions   a Case's camera, light and materials put on the Scene
drawing      a Case → our picture, the reference's, the difference between them, and a Result
silhouette   which pixels geometry covers, and how well two such masks agree
worker       the Cases of one item in a process of their own, which may crash
report       Results → report.json, and tables for the docs
page         Results → index.html

`python -m defshade_cli.measure.conformance build/conformance` does it all.
"""
