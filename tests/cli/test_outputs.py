"""Outputs: what may be replaced, what stays, and what happens where nothing can be written."""

import json
import os
import shlex
import shutil
import signal
import socket
import stat
import struct
import subprocess
import time

import h5py
import pytest
from conftest import BIN

LONGEST_NAME = 255  # bytes, of the usual file systems
LONGEST_ERROR = 2000  # bytes: path, place, reason and remedy have at most some hundred each


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    """A folder with t.png, a.glint and t.csv."""
    folder = tmp_path_factory.mktemp("inputs")
    subprocess.run([BIN / "glint-synth", "flakes", "--size", "64", "--seed", "1", "-o", "t.png"], cwd=folder, check=True)
    subprocess.run([BIN / "glint-ingest", "t.png", "-o", "a.glint"], cwd=folder, check=True)
    (folder / "t.csv").write_text("u,v,sigma,hx,hy\n.5,.5,4,.1,.1\n")
    return folder


@pytest.fixture
def shell(inputs, tmp_path):
    """Runs a line of bash in a copy of the inputs; programs are found by their names."""
    shutil.copytree(inputs, tmp_path, dirs_exist_ok=True)

    def run(line, **more):
        environment = {**os.environ, "PATH": f"{BIN}:{os.environ['PATH']}", **more}
        return subprocess.run(["bash", "-c", line], cwd=tmp_path, capture_output=True, timeout=120, env=environment)

    run.folder = tmp_path
    return run


def names(folder):
    return sorted(os.listdir(os.fsencode(folder)))


def mode_of(path):
    return stat.S_IMODE(os.stat(path).st_mode)


def assert_one_line(process):
    assert process.stderr.count(b"\n") == 1
    assert len(process.stderr) <= LONGEST_ERROR
    process.stderr.decode()  # is UTF-8


# What stands at the name of an output.


def test_a_link_stays_and_its_target_is_replaced(shell):
    (shell.folder / "store").mkdir()
    shell("cp a.glint store/real.glint; touch -d yesterday store/real.glint; ln -s store/real.glint l1; ln -s l1 l2")
    before = os.stat(shell.folder / "store/real.glint").st_mtime
    assert shell("glint-ingest t.png -o l2").returncode == 0
    assert os.readlink(shell.folder / "l2") == "l1"
    assert os.readlink(shell.folder / "l1") == "store/real.glint"
    assert os.stat(shell.folder / "store/real.glint").st_mtime > before


@pytest.mark.parametrize("make", ["glint-ingest t.png -o out.glint", "glint-query a.glint --csv t.csv -o out.glint"])
def test_a_link_to_nothing_makes_its_target(shell, make):
    (shell.folder / "store").mkdir()
    os.symlink("store/new.glint", shell.folder / "out.glint")
    assert shell(make).returncode == 0
    assert os.path.islink(shell.folder / "out.glint")
    assert (shell.folder / "store/new.glint").is_file()


def test_links_in_a_circle_are_an_error(shell):
    process = shell("ln -s x y; ln -s y x; glint-ingest t.png -o x")
    assert process.returncode == 2
    assert b"x: " in process.stderr and b"symbolic links" in process.stderr


@pytest.mark.parametrize("make", ["glint-ingest t.png -o out", "glint-query a.glint --csv t.csv -o out"])
@pytest.mark.parametrize("mode", [0o600, 0o640, 0o666])
def test_permissions_of_a_replaced_file_stay(shell, make, mode):
    shell(make)
    os.chmod(shell.folder / "out", mode)
    inode = os.stat(shell.folder / "out").st_ino
    assert shell(make).returncode == 0
    assert mode_of(shell.folder / "out") == mode
    assert os.stat(shell.folder / "out").st_ino != inode, "it was replaced, not written over"


def test_a_new_file_has_the_permissions_of_the_umask(shell):
    shell("umask 027; glint-ingest t.png -o out.glint; glint-query a.glint --csv t.csv -o out.csv")
    assert mode_of(shell.folder / "out.glint") == 0o640
    assert mode_of(shell.folder / "out.csv") == 0o640


@pytest.mark.skipif(os.getuid() != 0, reason="only root can give files away")
def test_the_owner_of_a_replaced_file_stays(shell):
    shell("cp a.glint out.glint")
    os.chown(shell.folder / "out.glint", 12, 34)
    assert shell("glint-ingest t.png -o out.glint").returncode == 0
    status = os.stat(shell.folder / "out.glint")
    assert (status.st_uid, status.st_gid) == (12, 34)


@pytest.mark.parametrize("make", ["glint-ingest t.png -o out", "glint-query a.glint --csv t.csv -o out"])
def test_a_read_only_output_needs_force(shell, make):
    shell(make)
    before = (shell.folder / "out").read_bytes()
    os.chmod(shell.folder / "out", 0o444)
    inode = os.stat(shell.folder / "out").st_ino
    process = shell(make)
    assert process.returncode == 2
    assert b"read-only" in process.stderr and b"--force" in process.stderr
    assert os.stat(shell.folder / "out").st_ino == inode
    assert shell(make + " --force").returncode == 0
    assert (shell.folder / "out").read_bytes() == before
    assert mode_of(shell.folder / "out") == 0o444


# What an output may replace.


@pytest.mark.parametrize("output", ["a.glint", "t.csv", "letter.txt", "prices.csv", "t.png"])
def test_a_table_replaces_only_an_earlier_answer(shell, output):
    (shell.folder / "letter.txt").write_text("Dear friend,\n")
    (shell.folder / "prices.csv").write_text("u,v,density\nwood,oak,.7\n")
    before = (shell.folder / output).read_bytes()
    for ask in ["--csv t.csv", "--uv .5 .5 --sigma 9 --samples 20"]:
        process = shell(f"glint-query a.glint {ask} -o {output}")
        assert process.returncode != 0
        assert b"--force" in process.stderr
        assert (shell.folder / output).read_bytes() == before


def test_an_earlier_answer_is_replaced(shell):
    for ask in ["--csv t.csv", "--uv .5 .5 --sigma 9 --samples 20", "--csv t.csv"]:
        assert shell(f"glint-query a.glint {ask} -o out.csv").returncode == 0


@pytest.mark.parametrize("depfile", ["t.png", "a.glint", "t.csv", "Makefile"])
def test_a_depfile_replaces_only_a_depfile(shell, depfile):
    (shell.folder / "Makefile").write_text("all: a.glint\n\ntouch a.glint\n")
    before = (shell.folder / depfile).read_bytes()
    process = shell(f"glint-ingest t.png -o o.glint --depfile {depfile}")
    assert process.returncode == 1
    assert (shell.folder / depfile).read_bytes() == before
    assert not (shell.folder / "o.glint").exists(), "checks come before the work"


def test_an_earlier_depfile_is_replaced(shell):
    for _ in range(2):
        assert shell("glint-ingest t.png -o o.glint --depfile o.d").returncode == 0


@pytest.mark.parametrize("image", ["t.csv.png", "a.glint.png"])
def test_an_image_replaces_only_an_image(shell, image):
    shell(f"cp {image.removesuffix('.png')} {image}")
    before = (shell.folder / image).read_bytes()
    for make in ["glint-query a.glint --uv .5 .5 --sigma 9 --image", "glint-synth flakes --size 16 -o"]:
        assert shell(f"{make} {image}").returncode == 1
        assert (shell.folder / image).read_bytes() == before


def test_an_asset_does_not_replace_hdf5_files_of_others(shell):
    with h5py.File(shell.folder / "data.h5", "w", libver="v110") as file:
        file["years"] = [1, 2, 3]
    before = (shell.folder / "data.h5").read_bytes()
    assert shell("glint-ingest t.png -o data.h5").returncode == 1
    assert (shell.folder / "data.h5").read_bytes() == before


def test_two_outputs_of_one_name_are_an_error(shell):
    for depfile in ["o.glint", "./o.glint", "link"]:
        os.symlink("o.glint", shell.folder / "link") if depfile == "link" else None
        process = shell(f"glint-ingest t.png -o o.glint --depfile {depfile} --force")
        assert process.returncode == 1
        assert b"two outputs" in process.stderr


def test_the_configuration_file_is_an_input_too(shell):
    (shell.folder / "run.toml").write_text("")
    assert shell("glint-ingest t.png -o run.toml --config run.toml").returncode == 1


# Devices, pipes and stdout.


@pytest.mark.parametrize(
    "make", ["glint-ingest t.png -o", "glint-query a.glint --csv t.csv -o", "glint-ingest t.png -o b.glint --depfile"]
)
def test_devices_are_written_to_and_stay_devices(shell, make):
    full, null = os.stat("/dev/full"), os.stat("/dev/null")
    process = shell(f"{make} /dev/full")
    assert process.returncode == 2
    assert b"/dev/full: cannot be written: No space left on device" in process.stderr
    assert shell(f"{make} /dev/null --force").returncode == 0
    assert (os.stat("/dev/full").st_rdev, os.stat("/dev/null").st_rdev) == (full.st_rdev, null.st_rdev)
    assert stat.S_ISCHR(os.stat("/dev/full").st_mode) and stat.S_ISCHR(os.stat("/dev/null").st_mode)


@pytest.mark.parametrize("path", ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1", "-"])
@pytest.mark.parametrize("target", ["| cat", "> redirected; cat redirected", ">> redirected; cat redirected"])
def test_stdout_can_be_an_output(shell, path, target):
    shell("glint-query a.glint --csv t.csv -o expected.csv")
    process = shell(f"glint-query a.glint --csv t.csv -o {path} {target}")
    assert process.stdout == (shell.folder / "expected.csv").read_bytes()


def test_assets_and_tables_go_through_pipes(shell):
    shell("glint-query a.glint --csv t.csv -o expected.csv")
    shell("mkfifo f; cat f > piped.csv & glint-query a.glint --csv t.csv -o f; wait")
    assert (shell.folder / "piped.csv").read_bytes() == (shell.folder / "expected.csv").read_bytes()
    assert stat.S_ISFIFO(os.stat(shell.folder / "f").st_mode)
    shell("cat f > piped.glint & glint-ingest t.png -o f; wait")
    assert (shell.folder / "piped.glint").read_bytes() == (shell.folder / "a.glint").read_bytes()


@pytest.mark.parametrize("make", ["glint-ingest t.png -o", "glint-synth flakes -o", "glint-ingest t.png -o b.glint --depfile"])
def test_dash_is_refused_where_no_table_is_made(shell, make):
    process = shell(f"{make} -")
    assert process.returncode == 1
    assert not (shell.folder / "-").exists()


def test_a_table_and_json_do_not_share_stdout(shell):
    process = shell("glint-query a.glint --csv t.csv -o - --json")
    assert process.returncode == 1
    assert json.loads(process.stdout)["error"]["code"] == "usage"


@pytest.mark.parametrize("count", [1, 200, 20000])  # less than the buffer of stdout, and more
def test_a_full_stdout_is_an_error(shell, count):
    process = shell(f"glint-query a.glint --uv .5 .5 --sigma 9 --samples {count} -o - > /dev/full")
    assert process.returncode == 2
    assert b"stdout cannot be written: No space left on device" in process.stderr


@pytest.mark.parametrize(
    "command", ["glint-info a.glint", "glint-info --help", "glint-info --version", "glint-validate a.glint -v"]
)
@pytest.mark.parametrize("target", ["> /dev/full", ">&-"])
def test_results_that_nobody_gets_are_an_error(shell, command, target):
    assert shell(f"{command} {target}").returncode == 2


@pytest.mark.parametrize("target", ["2> /dev/full", "2>&-", "2> /dev/full > /dev/full", "<&- >&- 2>&-"])
def test_a_stderr_that_takes_nothing_changes_no_exit_code(shell, target):
    assert shell(f"glint-validate none.glint {target}").returncode == 2
    assert shell(f"glint-pyramid a.glint --nonsense {target}").returncode == 1
    assert shell(f"glint-ingest t.png -o b.glint --progress json {target}").returncode == 0
    assert (shell.folder / "b.glint").read_bytes() == (shell.folder / "a.glint").read_bytes()


def test_a_reader_that_has_enough_ends_the_writer(shell):
    process = shell("glint-query a.glint --uv .5 .5 --sigma 9 --samples 20000 -o - | head -1; echo ${PIPESTATUS[0]}")
    assert process.stdout.splitlines() == [b"hx,hy,pdf", b"%d" % (128 + signal.SIGPIPE)]
    assert process.stderr == b""


@pytest.mark.parametrize("name", ["folder", "folder/", "socket"])
def test_what_cannot_be_written_is_refused(shell, name):
    (shell.folder / "folder").mkdir()
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(shell.folder / "socket"))
        for make in ["glint-ingest t.png -o", "glint-query a.glint --csv t.csv -o"]:
            process = shell(f"{make} {name} --force")
            assert process.returncode == 2
            assert name.encode() in process.stderr
    assert names(shell.folder / "folder") == []


# Names.


@pytest.mark.parametrize(
    "make", ["glint-ingest t.png -o", "glint-query a.glint --csv t.csv -o", "glint-ingest t.png -o b.glint --depfile"]
)
@pytest.mark.parametrize("name", [b"\xe9.glint", b"a\nb", b"n" * LONGEST_NAME, "ü".encode() * 127])
def test_any_name_that_a_file_can_have_works(shell, make, name):
    command = make.split() + [os.fsencode(name)]
    command[0] = BIN / command[0]
    if b"--depfile" in map(os.fsencode, command) and b"\n" in name:
        pytest.skip("Make's rules are tested elsewhere")
    for _ in range(2):
        process = subprocess.run(command, cwd=shell.folder, capture_output=True)
        assert process.returncode == 0, process.stderr
    assert name in names(shell.folder)
    assert not [n for n in names(shell.folder) if n.endswith(b".tmp")]


def test_a_name_that_no_file_can_have_is_named(shell):
    name = b"n" * (LONGEST_NAME + 1)
    process = subprocess.run([BIN / "glint-ingest", "t.png", "-o", name], cwd=shell.folder, capture_output=True)
    assert process.returncode == 2
    assert name in process.stderr and b"too long" in process.stderr
    assert b".tmp" not in process.stderr


def test_errors_show_names_that_are_no_text(shell):
    process = subprocess.run(
        [BIN / "glint-ingest", "t.png", "-o", b"no\x1b[2J\xe9/x.glint"], cwd=shell.folder, capture_output=True
    )
    assert process.returncode == 2
    assert b"no\\x1b[2J\\xe9/x.glint" in process.stderr
    assert_one_line(process)


# Limits, locks and signals.


@pytest.mark.parametrize("kilobytes", [1, 4, 50, 100])
def test_a_limit_on_the_size_of_files_leaves_nothing(shell, kilobytes):
    before = names(shell.folder)
    for make in [
        "glint-pyramid a.glint -o p.glint --stride 8",
        "glint-query a.glint --uv .5 .5 --sigma 9 --samples 20000 -o s.csv",
    ]:
        process = shell(f"ulimit -f {kilobytes}; {make}")
        assert process.returncode == 2
        assert b"File too large" in process.stderr
        assert_one_line(process)
        assert names(shell.folder) == before


@pytest.mark.parametrize("value", ["BEST_EFFORT", "TRUE", "1", "FALSE", None])
def test_hdf5_may_lock_files(shell, value):
    environment = {} if value is None else {"HDF5_USE_FILE_LOCKING": value}
    for _ in range(2):
        process = shell("glint-ingest t.png -o b.glint && glint-validate b.glint", **environment)
        assert process.returncode == 0, process.stderr
    assert (shell.folder / "b.glint").read_bytes() == (shell.folder / "a.glint").read_bytes()


# Opening an asset takes one descriptor, as loading the program does before: OpenTest in tests/unit has it.
def test_too_few_descriptors_are_not_damage(shell):
    process = shell("ulimit -n 4; glint-ingest t.png -o b.glint")
    assert process.returncode == 2
    assert b"Too many open files" in process.stdout + process.stderr
    assert b"damaged" not in process.stdout + process.stderr


def start_long_write(folder, output):
    """A run that works for long with a temporary file: it waits for a reader of a pipe."""
    os.mkfifo(folder / "pipe")
    environment = {**os.environ, "TMPDIR": str(folder / "temporary")}
    (folder / "temporary").mkdir()
    process = subprocess.Popen(
        [BIN / "glint-ingest", "t.png", "-o", output], cwd=folder, env=environment, stderr=subprocess.PIPE
    )
    deadline = time.monotonic() + 60
    while not names(folder / "temporary") and time.monotonic() < deadline:
        time.sleep(0.01)
    assert names(folder / "temporary"), "the run has begun to write"
    return process


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_signals_remove_the_temporary_file(shell, number):
    process = start_long_write(shell.folder, "pipe")
    process.send_signal(number)
    process.communicate(timeout=60)
    assert process.returncode == -number, "a shell shows 128 + n"
    assert names(shell.folder / "temporary") == []


def test_ignored_signals_stay_ignored(shell):
    signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as nohup does
    try:
        process = start_long_write(shell.folder, "pipe")
    finally:
        signal.signal(signal.SIGHUP, signal.SIG_DFL)
    process.send_signal(signal.SIGHUP)
    with open(shell.folder / "pipe", "rb") as pipe:
        assert pipe.read() == (shell.folder / "a.glint").read_bytes()
    process.communicate(timeout=60)
    assert process.returncode == 0


# Messages.


def test_a_file_that_other_libraries_have_much_to_say_about_makes_one_line(shell):
    # A TIFF of 20,000 strips that are all damaged: libtiff complains about each strip.
    rows, packed = 20000, 32773
    tags = {256: 64, 257: rows, 258: 8, 259: packed, 262: 2, 273: 8, 277: 3, 278: 1, 279: 100, 284: 1}
    entries = [struct.pack("<HHII", tag, 4, 1, value) for tag, value in tags.items()]
    tiff = b"II*\0" + struct.pack("<IH", 8, len(entries)) + b"".join(entries) + bytes(48)
    (shell.folder / "x.tif").write_bytes(tiff)
    process = shell("glint-ingest x.tif -o x.glint")
    assert process.returncode == 3
    assert_one_line(process)


def test_an_input_whose_name_an_asset_cannot_record_is_named(shell):
    for name, shown in (b"\xe9.png", b"\\xe9.png"), (b"\xc2\x85.png", b"\\xc2\\x85.png"):
        (shell.folder / os.fsdecode(name)).write_bytes((shell.folder / "t.png").read_bytes())
        process = subprocess.run([BIN / "glint-ingest", name, "-o", "o.glint"], cwd=shell.folder, capture_output=True)
        assert process.returncode == 2
        assert shown + b": its name is not UTF-8" in process.stderr and b"rename" in process.stderr


def test_a_damaged_asset_makes_one_line_without_addresses(shell):
    good = (shell.folder / "a.glint").read_bytes()
    for size in range(48, 2048, 97):
        damaged = bytearray(good)
        damaged[size] ^= 0xFF
        (shell.folder / "cut.glint").write_bytes(damaged)
        process = shell("glint-info cut.glint")
        assert process.returncode in (0, 3)
        assert b" = " not in process.stderr and len(process.stderr) <= LONGEST_ERROR


# The bytes of assets.


def covered(raw, address):
    """Ranges of the object header at an address, with its continuations (HDF5 format specification, IV.A.2)."""
    assert raw[address : address + 4] == b"OHDR"
    flags, at = raw[address + 5], address + 6
    at += (16 if flags & 0x20 else 0) + (4 if flags & 0x10 else 0)
    width = 1 << (flags & 3)
    begin = at + width
    end = begin + int.from_bytes(raw[at:begin], "little")
    chunks, ranges = [(begin, end)], [(address, end + 4)]
    head = 6 if flags & 4 else 4
    for begin, end in chunks:
        at = begin
        while at + head <= end:
            kind, size = raw[at], int.from_bytes(raw[at + 1 : at + 3], "little")
            if kind == 0x10:
                offset, length = struct.unpack("<QQ", raw[at + head : at + head + 16])
                assert raw[offset : offset + 4] == b"OCHK"
                chunks.append((offset + 4, offset + length - 4))
                ranges.append((offset, offset + length))
            at += head + size
    return ranges


def test_bytes_between_objects_are_zero(shell):
    shell(
        "glint-pyramid a.glint -o p.glint --stride 8; glint-compress p.glint -o c.glint; glint-binmap a.glint -o m.glint --alpha .05"
    )
    shell("glint-sat a.glint -o s.glint")
    for name in ["a.glint", "p.glint", "c.glint", "m.glint", "s.glint"]:
        raw = (shell.folder / name).read_bytes()
        ranges = [(0, 48), *covered(raw, int.from_bytes(raw[36:44], "little"))]
        with h5py.File(shell.folder / name, "r") as file:

            def visit(_, thing):
                ranges.extend(covered(raw, h5py.h5o.get_info(thing.id).addr))
                if isinstance(thing, h5py.Dataset) and thing.id.get_offset() is not None:
                    ranges.append((thing.id.get_offset(), thing.id.get_offset() + thing.id.get_storage_size()))

            file.visititems(visit)
        between, at = b"", 0
        for begin, end in sorted(ranges):
            assert begin >= at, "objects do not overlap"
            between += raw[at:begin]
            at = end
        assert at == len(raw)
        assert between and between == bytes(len(between))


@pytest.mark.parametrize("folder", ["my maps", "it's", "$(touch pwn)", "-p"])
def test_a_remedy_can_be_pasted(shell, folder):
    synth = f'glint-synth flakes --size 16 -o {shlex.quote("./" + folder)}/a.png'
    process = shell(synth)
    assert process.returncode == 2
    assert shell(process.stderr.decode().split("make it with ")[1]).returncode == 0
    assert shell(synth).returncode == 0
    assert not (shell.folder / "pwn").exists()


@pytest.mark.parametrize("name", ["a.bmp", "a.tga", "a.webp", "a.ppm", "a.gif"])
def test_a_picture_replaces_a_picture_of_any_format(shell, name):
    for _ in range(2):
        process = shell(f"glint-synth flakes --size 16 -o {name}")
        assert process.returncode == 0, process.stderr


def test_a_limit_of_memory_is_not_blamed_on_the_installation(shell):
    process = shell("ulimit -v 300000; glint-synth flakes --size 16 -o a.exr")
    assert process.returncode == 4
    assert b"memory" in process.stderr and b"install" not in process.stderr
