"""The form of messages: the rules that CONTRIBUTING.md has in words, as far as a program can tell."""

import re

import messages
import plain_words

MOST_WORDS = plain_words.LONG
# Hosts whose users read a message alone. Elsewhere something stands before it: a command, a function, a file.
HOSTS = ("blender-addon/", "meshlab-plugin/")
# Happened as it was asked for, and needs no remedy.
ASKED_FOR = ("cancelled", "Cancelled", "Cancelled: nothing was imported", "Cancelled: nothing was changed")
# Beginnings of texts that are no refusals though they are made like some, each with its reason.
EXCEPTIONS = {"the overlap of the points does not decide": "a note that says why the usual sense is taken"}
# Files of which no text reaches a reader.
INTERNAL = {"rust-core/geom/src/delaunay3/check.rs": "invariants of ours, which assertions and tests look at"}

# A sentence ends where the next one begins.
BORDER = re.compile(r"(?<=[.?])\s+(?=[A-Z{`\"])")
WORD = re.compile(r"[\w{}'/.-]*\w[\w{}'/.-]*|\{\}")
# They say nothing of what was found or expected.
VAGUE = re.compile(r"\b(invalid|illegal|bad|please|sorry|unfortunately|error occurred)\b|!(\s|$)", re.I)


def one_of(words):
    """A pattern of any of these words; a blank between two of them is one in the text, a hyphen is a blank."""
    return rf"\b(?:{'|'.join(word.replace('_', ' ') for word in words.split())})\b"


# A remedy: the reader is told to do something, at the beginning of a clause.
DO = one_of(
    "add align allow apply ask attach build call change check choose clip close collect convert copy correct crop cut"
    " deselect download drag end enlarge enter export fetch fill find fix flip free give go hide import install join"
    " keep leave lock look lower make mark measure merge move name normalize omit open order pack paint pass pick place"
    " plan point press project put raise read reconstruct record reduce remove rename repair replace restart run save"
    " say scale scan select send set shift shorten show split start stop switch take thicken transform triangulate try"
    " turn undistort undo unpack update use wait write"
)
REMEDY = re.compile(rf"(?:^|[:.,?(]\s?|\b(?:or|and|then|so|first|instead|to|not)\s)(?:{DO})", re.I)
# Words that say the allowed values, or the choices there are.
ALLOWED = re.compile(
    one_of(
        "must needs? takes? expected only alone but instead at_most at_least is_allowed are_allowed may_be may_have"
        " known_are the_most more_than goes_with go_with there_are they_are these_are not_both did_you_mean"
    ),
    re.I,
)
# Another message follows, or the question whether another name was meant.
FOLLOWED = re.compile(r"[\w}][:.] ?\{\}")
# Faults of files that nobody mends by hand. The file and the place in it stand before them.
DAMAGE = re.compile(
    one_of(
        "ends? cut_off cut_short damaged missing not_finite no_such beyond outside don't_fit doesn't_fit don't_match"
        " can't out_of_range became_shorter fewer unlike twice zero unknown too_large too_deep too_many too_long"
        " is_not are_not too_few there_is_no"
    )
)
# A thing that a reader can look for: a value, a name of code or of a host, a noun with what stands before one.
THING = re.compile(
    r"\{|`|\w[_.]\w|[A-Z]\w+ [A-Z]|\b(?:[Tt]he|[Aa]n?|[Nn]o|[Tt]his|[Tt]hese|[Ii]ts|[Aa]ll|[Ee]ach|[Bb]oth|[Tt]here"
    r"|[Ii]t|[Tt]hat|[Tt]wo|must|needs|takes|[Ss]elect)\b"
)


def faults(message):
    """Yields what is wrong with the form of a message."""
    text = messages.VALUE.sub("{}", message.text).strip()
    sentences = BORDER.split(text)
    if ";" in text:
        yield "has a semicolon: make two sentences of it"
    for sentence in sentences:
        count = len(WORD.findall(sentence))
        if count > MOST_WORDS:
            yield f"has a sentence of {count} words: at most {MOST_WORDS}"
        if plain_words.INVERTED.match(sentence[:1].upper() + sentence[1:]):
            yield "begins with a question word: say the subject first"
    if VAGUE.search(text):
        yield "is vague: say what was expected and what was found"
    if message.whole and not is_excepted(message, text):
        yield from faults_of_whole(message, text, sentences)


def is_excepted(message, text):
    """Whether a text need not be more than plain."""
    # Put together of parts that have a form of their own.
    is_joint = "{}" in text and len(re.findall(r"[a-z]+", text)) < 2
    is_known = text in ASKED_FOR or any(text.startswith(beginning) for beginning in EXCEPTIONS)
    return is_joint or is_known or message.file in INTERNAL


def faults_of_whole(message, text, sentences):
    """Yields what is wrong with a message that stands alone."""
    if message.file.startswith(HOSTS):
        if re.match(r"[a-z]+ ", text):
            yield "begins with a small letter: a window shows it"
    elif re.match(r"[A-Z][a-z]+[ ,]", text):
        yield "begins with a capital: something stands before it"
    if len(sentences) > 1 and not re.search(r"[.?}\"]$", text):
        yield "has several sentences: end the last one with a full stop"
    if len(sentences) == 1 and text.endswith("."):
        yield "is one sentence: leave out the full stop"
    says = REMEDY.search(text) or ALLOWED.search(text) or FOLLOWED.search(text)
    if not (says or message.of_file and DAMAGE.search(text)):
        yield "says neither what is allowed nor what to do"
    if not (message.of_file or THING.search(text)):
        yield "names neither a value nor a thing"
