"""Jobs as frames and files, and frames as work for many machines.

open_job, shots         a stage's frames, and the images of each      own_settings   what the stage sets for us
frames, names, targets  which frames, under which names, done or not  fingerprint    what a frame was made of
tasks, batch            chunks of frames, handed out and counted      report         what became of them
local, worker, limits   the engine of this machine                    dask           the engine of several
openjd                  the same for farms that schedule themselves
"""
