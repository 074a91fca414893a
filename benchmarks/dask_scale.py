"""What Dask's scheduler takes a task, with sleeping tasks in the places of a thousand workers.

    python benchmarks/dask_scale.py [TASKS [SECONDS]]

Every task sleeps SECONDS, as a chunk of frames on another host would keep a worker; all of them share this machine's
cores, so what is measured above the ideal is scheduling alone, of the workers' side too.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass

WORKERS, THREADS = 4, 250


@dataclass(frozen=True, slots=True)
class Simulation:
    """Sleeping tasks. seconds: of each.  submitted, taken: wall seconds until all were handed over, and done.

    cpu: processor seconds of scheduler, client and workers.
    """

    tasks: int
    seconds: float
    submitted: float
    taken: float
    cpu: float

    @property
    def ideal(self) -> float:
        """Seconds that the tasks would take if scheduling took none."""
        return -(-self.tasks // (WORKERS * THREADS)) * self.seconds


def simulate(tasks: int, seconds: float) -> Simulation:
    """Run them on a cluster of this process."""
    from distributed import Client, LocalCluster, as_completed

    with (
        LocalCluster(n_workers=WORKERS, threads_per_worker=THREADS, processes=False, dashboard_address=None) as cluster,
        Client(cluster) as client,
    ):
        start, cpu = time.perf_counter(), time.process_time()
        futures = [client.submit(time.sleep, seconds, pure=False, key=f"chunk-{number}") for number in range(tasks)]
        submitted = time.perf_counter() - start
        for _ in as_completed(futures):
            pass
        return Simulation(tasks, seconds, submitted, time.perf_counter() - start, time.process_time() - cpu)


if __name__ == "__main__":
    arguments = sys.argv[1:]
    found = simulate(int(arguments[0]) if arguments else 5000, float(arguments[1]) if len(arguments) > 1 else 4.0)
    print(f"{found.tasks} tasks of {found.seconds:g} s: {found.taken:.1f} s, ideally {found.ideal:.1f} s")
    print(f"submitted in {found.submitted:.1f} s; {1e3 * found.cpu / found.tasks:.2f} CPU-ms a task")
