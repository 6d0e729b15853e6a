# SPDX-License-Identifier: BSD-3-Clause
"""What others get while a viewer is crowded, and how soon it ends.

  viewer_load.py PROGRAM RUN [--seconds 30] [--viewers 10]

PROGRAM: orbitfuse; RUN: the --out folder of a finished run. At once: VIEWERS ask for pictures of 640x480 without
a pause, ten ask for the page and read nothing, twenty send a byte a second, and one asks and closes in the middle
four times a second. Meanwhile the page, the scene and a first picture (80x60) are asked for. At last Ctrl-C.
"""
import argparse
import http.client
import json
import re
import signal
import socket
import statistics
import subprocess
import threading
import time

HEAD = {"X-OrbitFuse": "1", "Content-Type": "application/json"}


def ask(port, method, path, body=None):
    """Seconds to the whole answer, its status and its bytes."""
    begun = time.monotonic()
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=120)
    connection.request(method, path, None if body is None else json.dumps(body), HEAD)
    answer = connection.getresponse()
    read = answer.read()
    connection.close()
    return time.monotonic() - begun, answer.status, read


def resident_mb(pid, key):
    with open(f"/proc/{pid}/status", encoding="ascii") as status:
        return int(re.search(key + r":\s+(\d+)", status.read()).group(1)) / 1024


class Crowd:
    """Threads that go on until stop()."""

    def __init__(self, port, scene, viewers):
        self.port, self.scene, self.ended = port, scene, threading.Event()
        self.pictures = 0
        self.threads = [threading.Thread(target=self.view, args=(i,)) for i in range(viewers)]
        self.threads += [threading.Thread(target=f) for f in (self.never_read, self.drip, self.close_midway)]
        for thread in self.threads:
            thread.start()

    def shot(self, client, width, height, view):
        camera = self.scene["views"][view % len(self.scene["views"])]
        return {"client": client, "width": width, "height": height, "layers": ["thermal", "fused"],
                **{key: camera[key] for key in ("position", "rotation_wxyz", "fov_deg")}}

    def view(self, number):
        turn = number
        while not self.ended.is_set():
            try:
                _, status, _ = ask(self.port, "POST", "/render", self.shot(f"viewer {number}", 640, 480, turn))
            except OSError:
                return  # it has ended
            self.pictures += status == 200
            turn += 1

    def never_read(self):
        peers = []
        for _ in range(10):
            peer = socket.socket()
            peer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            peer.connect(("127.0.0.1", self.port))
            peer.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
            peers.append(peer)
        self.ended.wait()

    def drip(self):
        request = b"POST /render HTTP/1.1\r\nHost: 127.0.0.1\r\nX-OrbitFuse: 1\r\nContent-Length: 9999\r\n\r\n"
        peers = [socket.create_connection(("127.0.0.1", self.port)) for _ in range(20)]
        for i in range(10**6):
            if self.ended.wait(1):
                return
            for j, peer in enumerate(peers):
                try:
                    peer.send(request[i % len(request):][:1])
                except OSError:  # it was closed for its slowness: another comes
                    try:
                        peers[j] = socket.create_connection(("127.0.0.1", self.port))
                    except OSError:
                        return

    def close_midway(self):
        body = json.dumps(self.shot("who leaves", 640, 480, 3)).encode()
        whole = b"POST /render HTTP/1.1\r\nHost: 127.0.0.1\r\nX-OrbitFuse: 1\r\nContent-Length: %d\r\n\r\n" % len(body) + body
        for i in range(10**6):
            if self.ended.wait(0.25):
                return
            try:
                with socket.create_connection(("127.0.0.1", self.port)) as peer:
                    peer.sendall(whole if i % 2 else b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
                    if i % 2 == 0:
                        peer.recv(100)
            except OSError:
                return

    def stop(self):
        self.ended.set()


def main():
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("program")
    words.add_argument("run")
    words.add_argument("--seconds", type=float, default=30)
    words.add_argument("--viewers", type=int, default=10)
    options = words.parse_args()
    viewer = subprocess.Popen([options.program, "view", options.run, "--page", "0"], stderr=subprocess.PIPE, text=True)
    port = None
    for line in viewer.stderr:
        port = port or (re.search(r"http://127\.0\.0\.1:(\d+)", line) or [None, None])[1]
        if "Ctrl-C" in line:
            break
    port = int(port)
    threading.Thread(target=viewer.stderr.read, daemon=True).start()
    scene = json.loads(ask(port, "GET", "/scene")[2])
    while ask(port, "GET", "/mesh")[1] == 202:  # making it takes both cores
        time.sleep(0.5)
    alone_mb = resident_mb(viewer.pid, "VmRSS")
    crowd = Crowd(port, scene, options.viewers)
    time.sleep(2)
    waits = {"page": [], "scene": [], "first picture": []}
    end = time.monotonic() + options.seconds
    while time.monotonic() < end:
        for what, question in (("page", ("GET", "/")), ("scene", ("GET", "/scene")),
                               ("first picture", ("POST", "/render", crowd.shot("another", 80, 60, len(waits["page"]))))):
            seconds, status, _ = ask(port, *question)
            assert status == 200, (what, status)
            waits[what].append(seconds)
        time.sleep(0.2)
    most_mb = resident_mb(viewer.pid, "VmHWM")
    begun = time.monotonic()
    viewer.send_signal(signal.SIGINT)
    code = viewer.wait(timeout=60)
    ended = time.monotonic() - begun
    crowd.stop()
    print("| what | median, s | most, s | times |\n|---|---|---|---|")
    for what, seconds in waits.items():
        print(f"| {what} | {statistics.median(seconds):.3f} | {max(seconds):.3f} | {len(seconds)} |")
    print(f"\nexit code {code} {ended:.2f} s after Ctrl-C; memory {alone_mb:.0f} MB alone, {most_mb:.0f} MB at most; "
          f"{crowd.pictures} pictures of 640x480 for {options.viewers} viewers")


if __name__ == "__main__":
    main()
