"""Names in any script: no picture fails or warns for want of a font."""

import warnings

from matplotlib.font_manager import FontEntry, fontManager
from matplotlib.mathtext import MathTextParser
from PIL import Image

from escort_mj.report.figures.drawing import fonts, style
from escort_mj.report.figures.drawing.fonts import BOX, FONT, finish_texts, font_file, legible
from escort_mj.report.figures.drawing.style import figure

NOWHERE = "\U0010fffd"  # of the private use planes: no font has it


def test_what_the_font_has_stays_and_what_it_lacks_is_a_box():
    assert legible("Zwölf µm, ≤ 3") == "Zwölf µm, ≤ 3"
    assert legible(f"a{NOWHERE}b") == f"a{BOX}b"
    assert BOX in fonts._letters(font_file())


def test_a_figure_with_letters_that_no_font_has_is_drawn_without_a_warning(tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with figure(tmp_path / "a.png", 2.0, f"run {NOWHERE}", note=f"{NOWHERE}\nends") as canvas:
            axes = canvas.subplots()
            axes.plot([0, 1], label=NOWHERE)
            axes.legend()
    assert [text.get_text() for text in canvas.texts] == [f"run {BOX}", f"{BOX}\nends"]
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.size == (round(7.2 * style.DPI), 2 * style.DPI)


def test_another_font_of_the_machine_helps_out(monkeypatch, tmp_path):
    """matplotlib ships a font of mathematics with letters that DejaVu Sans lacks."""
    fonts._font_with.cache_clear()
    private = next(
        letter for letter in sorted(fonts._letters(_stix())) if letter not in fonts._letters(font_file())
    )
    monkeypatch.setattr(fontManager, "ttflist", [FontEntry(fname=_stix(), name="STIXGeneral")])
    with figure(tmp_path / "a.png", 2.0, f"run {private}") as canvas:
        pass
    title = canvas.texts[0]
    assert title.get_text() == f"run {private}"
    assert title.get_fontfamily() == [FONT, "STIXGeneral"]
    fonts._font_with.cache_clear()


def test_signs_of_mathematics_are_drawn_as_they_stand(tmp_path, monkeypatch):
    """Where matplotlib takes `$...$` for mathematics, most names are errors, and others lose letters."""
    parsed = []
    parser = MathTextParser.parse

    def parse(self, words, *rest, **options):
        parsed.append(words)
        return parser(self, words, *rest, **options)

    monkeypatch.setattr(MathTextParser, "parse", parse)
    names = ["$x^$", "$$", r"a\b_c^d", r"\$x\$", "$5 and $6"]
    with figure(tmp_path / "a.png", 3.0, names[0], note=names[1]) as canvas:
        grid = canvas.subplots(2, 1, sharey=True)
        for axes in grid:
            axes.plot([1, 2], [0, 4], label=names[2])
            axes.set(title=names[3], xlabel=names[4], xscale="log")
            axes.set_yticks(range(len(names)), names)
            axes.annotate(names[0], (1, 1))
            axes.legend(title=names[1])
        canvas.legend([axes.lines[0]], [names[0]])
        canvas.colorbar(axes.scatter([1, 2], [1, 2], c=[0, 1])).set_label(names[0])
    assert not [words for words in parsed if "mathdefault" not in words]
    shown = [label._preprocess_math(label.get_text()) for label in grid[0].get_yticklabels()]
    assert shown == [(name, False) for name in names]


def test_plain_words_keep_the_one_font(tmp_path):
    with figure(tmp_path / "a.png", 2.0, "run") as canvas:
        finish_texts(canvas)
    assert canvas.texts[0].get_fontfamily() == [FONT]


def _stix() -> str:
    return font_file().replace("DejaVuSans.ttf", "STIXGeneral.ttf")
