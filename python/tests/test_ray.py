"""FairBatch on Ray Data: three nodes on loopback addresses, of which one is killed on the way."""

import os
import signal
import subprocess
import sys

import pytest

pytest.importorskip("ray")
pytest.importorskip("pyarrow")

RAY = """
import os, signal, sys, threading, time

# Nothing is reported, asked for or shown.
os.environ.update(RAY_AUTH_MODE="disabled", RAY_USAGE_STATS_ENABLED="0", RAY_DEDUP_LOGS="0", RAY_DATA_DISABLE_PROGRESS_BARS="1")
import pyarrow as pa
import ray, ray.data
from ray.cluster_utils import Cluster
from test_tables import FAIR, bits, table

def slow(part):
    time.sleep(0.5)
    return FAIR(part)

# More logical CPUs than there are: workers must leave some for reading.
node = {"num_cpus": 2, "object_store_memory": 100 * 2**20}
cluster = Cluster(initialize_head=True, head_node_args={**node, "node_ip_address": "127.0.0.2", "include_dashboard": False})
others = [cluster.add_node(**node, node_ip_address=f"127.0.0.{k}") for k in (3, 4)]
ray.init(address=cluster.address, log_to_driver=False)
assert len(ray.nodes()) == 3
given = table(2000, seed=5)
# A small table is one block: divided, every node has some of it.
data = ray.data.from_arrow(given).repartition(20)
if sys.argv[1] == "killed":
    parts = data.map_batches(slow, batch_format="pyarrow", batch_size=100)
    threading.Timer(2, cluster.remove_node, (others[0],), {"allow_graceful": False}).start()
else:
    parts = data.map_batches(FAIR, batch_format="pyarrow", batch_size=100)
made = pa.concat_tables(ray.get(parts.to_arrow_refs())).sort_by("id")
alive = lambda: sum(node["Alive"] for node in ray.nodes())
patience = time.monotonic() + 60
while sys.argv[1] == "killed" and alive() == 3 and time.monotonic() < patience:
    time.sleep(0.1)
assert alive() == (2 if sys.argv[1] == "killed" else 3), alive()
assert bits(made) == bits(FAIR(given))
print("same bits", flush=True)
ray.shutdown()
cluster.shutdown()
"""


@pytest.mark.parametrize("fate", ["kept", "killed"])
def test_ray_gives_the_bits_of_one_process(tmp_path, fate):
    script = tmp_path / "spread.py"
    script.write_text(RAY)
    environment = {**os.environ, "PYTHONPATH": os.path.dirname(os.path.abspath(__file__)), "RAY_TMPDIR": "/tmp"}
    # A session of its own, so that all of its processes can be ended.
    child = subprocess.Popen(
        [sys.executable, str(script), fate],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=tmp_path, env=environment, start_new_session=True,
    )  # fmt: skip
    try:
        said, _ = child.communicate(timeout=180)
    finally:
        try:
            os.killpg(child.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
    assert "same bits" in said, said[-3000:]
