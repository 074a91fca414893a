"""What Dask's scheduler takes a task, with sleeping tasks in the places of a thousand workers: `make bench-farm`.

    python benchmarks/dask_scale.py [TASKS [SECONDS]]

Every task sleeps SECONDS, as a chunk of frames on another host would keep a worker; all of them share this machine's
cores, so what is measured above the ideal is scheduling alone.
"""

from __future__ import annotations

import sys
import time

WORKERS, THREADS = 4, 250


def main(tasks: int, seconds: float) -> None:
    from distributed import Client, LocalCluster, as_completed

    with (
        LocalCluster(n_workers=WORKERS, threads_per_worker=THREADS, processes=False, dashboard_address=None) as cluster,
        Client(cluster) as client,
    ):
        start = time.perf_counter()
        futures = [client.submit(time.sleep, seconds, pure=False, key=f"chunk-{number}") for number in range(tasks)]
        submitted = time.perf_counter() - start
        for _ in as_completed(futures):
            pass
        taken = time.perf_counter() - start
    ideal = tasks / (WORKERS * THREADS) * seconds
    print(f"{tasks} tasks of {seconds:g} s on {WORKERS * THREADS} threads: {taken:.1f} s, ideally {ideal:.1f} s")
    print(f"submitted in {submitted:.1f} s; {1e3 * (taken - ideal) / tasks:.2f} ms a task above the ideal")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000, float(sys.argv[2]) if len(sys.argv) > 2 else 5.0)
