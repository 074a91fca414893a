"""Peers, each a program of its own: `python render_<peer>.py STAGE IMAGE WIDTH HEIGHT [SAMPLES]`.

They import nothing of ours but render_mitsuba.py, so that they can run in an environment that holds the peer alone.
"""
