import gui


def s():
    yield 1


gui.play(s())
