"""pipelines/farm/glint-farm.sbatch on Slurm itself: daemons of this test's own, on this machine, without systemd.

Needs root. Packages that are missing are installed where GLINT_TEST_INSTALL is set, by

    apt-get install --no-install-recommends slurmctld slurmd slurm-client munge
"""

import json
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import time

import pytest

ROOT = pathlib.Path(__file__).parents[2]
BIN = pathlib.Path(os.environ.get("GLINT_BIN_DIR", ROOT / "build/bin")).resolve()
PACKAGES = ["slurmctld", "slurmd", "slurm-client", "munge"]
PATIENCE_S = 120
MAPS, TASKS = 8, 2
CONFIGURATION = """
ClusterName=glint
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
ReturnToService=2
NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} State=UNKNOWN
PartitionName=all Nodes={host} Default=YES State=UP
"""


def free_ports(count):
    sockets = [socket.socket() for _ in range(count)]
    for one in sockets:
        one.bind(("127.0.0.1", 0))
    ports = [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()
    return ports


def wait_until(true, what):
    deadline = time.monotonic() + PATIENCE_S
    while not true():
        assert time.monotonic() < deadline, what
        time.sleep(0.1)


class Cluster:
    """munged, slurmctld and slurmd, with all their files in one folder."""

    def __init__(self, folder):
        self.folder = folder
        self.daemons = []
        for name in ("state", "spool"):
            (folder / name).mkdir()
        (folder / "munge.key").write_bytes(os.urandom(128))
        (folder / "munge.key").chmod(0o400)
        (folder / "slurm.conf").write_text(
            CONFIGURATION.format(
                host=socket.gethostname().split(".")[0], folder=folder, ports=free_ports(2), cpus=os.cpu_count()
            )
        )
        self.environment = {
            **os.environ,
            "SLURM_CONF": str(folder / "slurm.conf"),
            "PATH": f"{BIN}:/usr/sbin:{os.environ['PATH']}",
        }
        self.start(
            "munged",
            "--foreground",
            "--force",
            f"--socket={folder}/munge.socket",
            f"--key-file={folder}/munge.key",
            f"--pid-file={folder}/munged.pid",
            f"--seed-file={folder}/munged.seed",
            f"--log-file={folder}/munged.log",
        )
        wait_until((folder / "munge.socket").exists, "munged does not start")
        self.start("slurmctld", "-D", "-c")
        self.start("slurmd", "-D")
        wait_until(lambda: "idle" in self.run("sinfo", "-h", "-o", "%T"), "slurmd does not register")

    def start(self, *words):
        with open(self.folder / f"{words[0]}.output", "w") as output:
            self.daemons.append(subprocess.Popen(words, env=self.environment, stdout=output, stderr=output))

    def run(self, *words, folder=None):
        return subprocess.run(
            list(map(str, words)), env=self.environment, cwd=folder, capture_output=True, text=True, timeout=60
        ).stdout

    def states(self, job):
        """{task: state} of the tasks of a job."""
        lines = self.run("scontrol", "show", "job", job, "-o").splitlines()
        fields = [dict(word.split("=", 1) for word in line.split() if "=" in word) for line in lines]
        return {int(field["ArrayTaskId"]): field["JobState"] for field in fields if field.get("ArrayTaskId", "").isdigit()}

    def stop(self):
        for daemon in reversed(self.daemons):
            daemon.terminate()
        for daemon in self.daemons:
            try:
                daemon.wait(timeout=20)
            except subprocess.TimeoutExpired:
                daemon.kill()


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    if os.getuid() != 0:
        pytest.skip("needs root")
    missing = [
        name
        for name in ("slurmctld", "slurmd", "sbatch", "munged")
        if shutil.which(name, path=f"/usr/sbin:{os.environ['PATH']}") is None
    ]
    if missing and os.environ.get("GLINT_TEST_INSTALL"):
        subprocess.run(
            ["apt-get", "-q", "-y", "install", "--no-install-recommends", *PACKAGES],
            check=True,
            env={**os.environ, "DEBIAN_FRONTEND": "noninteractive"},
        )
    elif missing:
        pytest.skip(f"{missing} are not installed; set GLINT_TEST_INSTALL to install {PACKAGES}")
    cluster = Cluster(tmp_path_factory.mktemp("slurm"))
    yield cluster
    cluster.stop()


def tool(folder, *words):
    return subprocess.run([BIN / words[0], *words[1:]], cwd=folder, check=True, capture_output=True, text=True).stdout


def contents(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*.glint"))}


def kill_task(task):
    """Kills the glint-farm of a task while it runs a program. Returns whether there was one."""
    for path in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            words = (path / "cmdline").read_bytes().split(b"\0")
            children = (path / "task" / path.name / "children").read_text()
        except OSError:
            continue
        if words[0].endswith(b"glint-farm") and f"{task}/{TASKS}".encode() in words and children:
            os.kill(int(path.name), signal.SIGKILL)
            return True
    return False


def test_an_array_whose_worker_is_killed_ends_with_every_asset_as_a_local_run_makes_it(cluster, tmp_path):
    maps = tmp_path / "maps"
    maps.mkdir()
    for seed in range(MAPS):
        tool(maps, "glint-synth", "flakes", "--size", "512", "--seed", str(seed), "-o", f"{seed}.png")
    plan = ["glint-farm", "plan", maps, "-o", "farm.json", "--make", "pyramid --stride 16"]
    for name in ("local", "slurm"):
        (tmp_path / name).mkdir()
        tool(tmp_path / name, *plan)
    tool(tmp_path / "local", "glint-farm", "run", "farm.json")
    folder = tmp_path / "slurm"

    job = cluster.run(
        "sbatch", "--parsable", f"--array=1-{TASKS}", ROOT / "pipelines/farm/glint-farm.sbatch", "farm.json", folder=folder
    ).strip()
    assert job.isdigit(), (cluster.folder / "slurmctld.log").read_text()[-2000:]
    wait_until(lambda: kill_task(1), "task 1 does not start")
    wait_until(
        lambda: set(cluster.states(job).values()) <= {"COMPLETED", "FAILED", "NODE_FAIL"} and len(cluster.states(job)) == TASKS,
        "tasks do not end",
    )
    assert cluster.states(job)[1] == "FAILED"
    status = json.loads(tool(folder, "glint-farm", "status", "farm.json", "--json"))["result"]
    assert status["done"] < status["entries"], "the kill came mid-way"

    cluster.run("scontrol", "requeue", f"{job}_1")
    cluster.run("scontrol", "update", f"jobid={job}_1", "StartTime=now")  # Slurm waits two minutes by default
    wait_until(lambda: cluster.states(job)[1] == "COMPLETED", "the task does not run again")
    assert contents(folder / "assets") == contents(tmp_path / "local/assets") and len(contents(folder / "assets")) == 2 * MAPS
    tool(folder, "glint-validate", *sorted((folder / "assets").glob("*.glint")))
    assert not list(folder.rglob("*.tmp"))
