"""What the library hands to whoever shows it: notes on the way, an answer at the end."""

from excite_cli.excitation.progress import ProgressMeasure as ProgressMeasure
from excite_cli.excitation.progress import figure_in_words as figure_in_words
from excite_cli.shown.answer import Answer as Answer
from excite_cli.shown.answer import Command as Command
from excite_cli.shown.answer import Part as Part
from excite_cli.shown.answer import Table as Table
from excite_cli.shown.answer import as_word as as_word
from excite_cli.shown.note import Level as Level
from excite_cli.shown.note import Note as Note
from excite_cli.shown.note import Tell as Tell
from excite_cli.shown.note import saying as saying
