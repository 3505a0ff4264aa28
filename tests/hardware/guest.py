"""A virtual machine with Debian's stock kernel, in which this computer's files can be run.

Real drivers (``uvcvideo``, ``cdc_acm``, ``vhci_hcd``) need a kernel that may load them. QEMU boots
one without any privilege; the guest mounts this computer's files read-only, so that one virtual
environment serves both. Nothing is installed: packages are unpacked into a cache folder.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Timer

from platformdirs import user_cache_path

_BOOT_MODULES = ("virtio_pci", "virtio_net", "9pnet_virtio", "9p", "overlay")
"""Kernel modules for this computer's files and its network."""

_PACKAGES = ("busybox-static",)
_KERNEL = re.compile(r"linux-image-[0-9][^ ]*-amd64$", re.MULTILINE)

_INIT = """#!/bin/busybox sh
busybox=/bin/busybox
$busybox mount -t proc proc /proc; $busybox mount -t sysfs sys /sys
$busybox mount -t devtmpfs dev /dev
for module in $($busybox cat /modules/order); do $busybox insmod /modules/$module; done
$busybox mount -t 9p -o trans=virtio,version=9p2000.L,msize=262144,cache=loose,ro root /lower
$busybox mount -t tmpfs tmpfs /rw; $busybox mkdir /rw/upper /rw/work
$busybox mount -t overlay -o lowerdir=/lower,upperdir=/rw/upper,workdir=/rw/work all /root
for place in proc sys dev; do $busybox mount --move /$place /root/$place; done
$busybox cp /job /root/run/job
exec $busybox switch_root /root /bin/bash /run/job
"""

_JOB = """
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME=/root
mount -t tmpfs tmpfs /tmp; mkdir -p /dev/shm /dev/pts; mount -t tmpfs tmpfs /dev/shm
mount -t devpts devpts /dev/pts; mount -t tmpfs tmpfs /run
/lower/bin/busybox true 2>/dev/null
mount -t debugfs debug /sys/kernel/debug
{network}
cd {folder}
echo; echo "=== job begins"
{command}
echo "=== job ends $?"
echo o > /proc/sysrq-trigger; sleep 10
"""

_NETWORK = """
{busybox} ip link set lo up; {busybox} ip link set eth0 up
{busybox} ip addr add 10.0.2.15/24 dev eth0; {busybox} ip route add default via 10.0.2.2
"""

_BEGINS = "=== job begins\n"
_ACCELERATORS = (("kvm", "host", 40.0), ("tcg", "max", 300.0))
"""Ways to run the guest: by the processor itself where that works, else emulated; and the time, s,
after which its job must have begun."""

HOST = "10.0.2.2"
"""Address under which the guest reaches servers on this computer's loopback."""


class Unavailable(Exception):
    """What a guest needs cannot be had here; the message says what and why."""


@dataclass(frozen=True)
class Software:
    """Unpacked packages.

    Attributes
    ----------
    kernel : Path
    modules : mapping of str to Path
        Kernel module files by name, with underscores.
    busybox : Path
    """

    kernel: Path
    modules: Mapping[str, Path]
    busybox: Path


def software() -> Software:
    """Return kernel and busybox; download them from Debian's archive when first used.

    Raises
    ------
    Unavailable
        QEMU is missing, or the packages cannot be downloaded.
    """
    if shutil.which("qemu-system-x86_64") is None:
        raise Unavailable("qemu is not installed; 'apt install qemu-system-x86'")
    folder = user_cache_path("tactile-core") / "hardware"
    unpacked = folder / "unpacked"
    if not any(unpacked.glob("boot/vmlinuz-*")):
        _download(folder, unpacked)
    (kernel,) = unpacked.glob("boot/vmlinuz-*")
    files = {path.stem.replace("-", "_"): path for path in unpacked.rglob("*.ko")}
    return Software(kernel, files, unpacked / "bin" / "busybox")


def _download(folder: Path, unpacked: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    try:
        kernel = _KERNEL.search(_output("apt-cache", "depends", "linux-image-amd64"))
        if kernel is None:
            raise Unavailable("Debian's archive has no kernel for this computer")
        # an interrupted download leaves nothing behind that the next one could take for its own
        with TemporaryDirectory(dir=folder) as fresh:
            _output("apt-get", "download", kernel[0], *_PACKAGES, cwd=Path(fresh))
            for package in Path(fresh).glob("*.deb"):
                _output("dpkg", "--extract", str(package), str(Path(fresh) / "unpacked"))
            (Path(fresh) / "unpacked").rename(unpacked)
    except (OSError, subprocess.SubprocessError) as error:
        raise Unavailable(
            f"Debian's kernel and busybox cannot be downloaded ({error}); 'apt-get update' makes "
            f"them known"
        ) from error


def _output(*command: str, cwd: Path | None = None) -> str:
    return subprocess.run(
        command, cwd=cwd, check=True, capture_output=True, text=True, timeout=300
    ).stdout


def run_in_guest(
    command: str, folder: Path, work: Path, *, modules: Sequence[str] = (), timeout_s: float = 300
) -> tuple[int, str]:
    """Boot a guest, run a command in it and return its exit status and output.

    Parameters
    ----------
    command : str
        For bash, as root.
    folder : Path
        Where it runs; the guest sees all of this computer's files, and its changes are lost.
    work : Path
        An empty folder for the guest's own files.
    modules : sequence of str
        Kernel modules to load, with those that they need.

    Raises
    ------
    Unavailable
        See :func:`software`; or the guest did not start.
    """
    given = software()
    network = _NETWORK.format(busybox=given.busybox)
    job = _JOB.format(network=network, folder=folder, command=command)
    archive = work / "initramfs"
    archive.write_bytes(_initramfs(given, [*_BOOT_MODULES, *modules], job))
    for accelerator, processor, boot_s in _ACCELERATORS:
        text = _booted(given.kernel, archive, accelerator, processor, boot_s, timeout_s)
        _, began, rest = text.partition(_BEGINS)
        if began:
            printed, _, status = rest.partition("=== job ends ")
            return int(status.split()[0]) if status.strip() else -1, printed
    raise Unavailable(f"the guest did not start:\n{text[-2000:]}")


def _booted(
    kernel: Path, archive: Path, accelerator: str, processor: str, boot_s: float, timeout_s: float
) -> str:
    """Run the machine until it switches itself off; return what it printed.

    It has one processor: on two emulated ones the kernel's workers deliver some images in the
    wrong order, and this computer's other processor is for the devices and the network. In some
    virtual machines KVM accepts a guest whose kernel then never starts, so one whose job has not
    begun after ``boot_s`` is ended.
    """
    command = [
        *("qemu-system-x86_64", "-machine", f"q35,accel={accelerator}", "-cpu", processor),
        *("-smp", "1", "-m", "2G", "-nographic", "-no-reboot"),
        *("-kernel", str(kernel), "-initrd", str(archive)),
        *("-append", "console=ttyS0 quiet loglevel=1 panic=-1"),
        *("-nic", "user,model=virtio-net-pci"),
        "-virtfs",
        "local,path=/,mount_tag=root,security_model=none,readonly=on,multidevs=remap",
    ]
    with subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    ) as machine:
        assert machine.stdout is not None
        output = bytearray()
        timers = [Timer(limit_s, machine.kill) for limit_s in (boot_s, timeout_s)]
        for timer in timers:
            timer.start()
        try:
            for line in machine.stdout:
                output += line.replace(b"\r", b"")
                if output.endswith(_BEGINS.encode()):
                    timers[0].cancel()
        finally:
            for timer in timers:
                timer.cancel()
            machine.kill()
    return output.decode("utf-8", "replace")


def _initramfs(given: Software, modules: Iterable[str], job: str) -> bytes:
    """Return the guest's first files as an archive of the kernel's format ("newc")."""
    order = _in_order(given.modules, modules)
    chosen = [given.modules[name] for name in order]
    files = {
        "init": _INIT.encode(),
        "job": job.encode(),
        "bin/busybox": given.busybox.read_bytes(),
        "modules/order": "\n".join(path.name for path in chosen).encode(),
        **{f"modules/{path.name}": path.read_bytes() for path in chosen},
    }
    folders = ("bin", "modules", "proc", "sys", "dev", "lower", "rw", "root")
    entries = [_entry(name, 0o040755, b"") for name in folders]
    entries += [_entry(name, 0o100755, data) for name, data in files.items()]
    return b"".join([*entries, _entry("TRAILER!!!", 0, b"")])


def _entry(name: str, mode: int, data: bytes) -> bytes:
    path = name.encode() + b"\0"
    numbers = (0, mode, 0, 0, 1, 0, len(data), 0, 0, 0, 0, len(path), 0)
    head = b"070701" + b"".join(b"%08x" % number for number in numbers) + path
    return head + bytes(-len(head) % 4) + data + bytes(-len(data) % 4)


def _in_order(files: Mapping[str, Path], modules: Iterable[str]) -> list[str]:
    """Return modules and what they need, each after what it needs."""
    order: list[str] = []

    def add(name: str) -> None:
        if name in order or name not in files:  # the latter are built into the kernel
            return
        depends = re.search(rb"\0depends=([^\0]*)", files[name].read_bytes())
        for needed in (depends[1].decode() if depends else "").split(","):
            add(needed.replace("-", "_"))
        order.append(name)

    for module in modules:
        add(module.replace("-", "_"))
    return order
