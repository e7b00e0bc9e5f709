"""Structured Text by the grammar of IEC 61131-3 (edition 2, Annex B), strictly: what a function block of ours has.

Each statement ends with a semicolon, one of a control structure too, comments do not nest, and no name is a word of the
standard or of a tool. A text that is not of it is an error of Lark's.
"""

from functools import cache

from lark import Lark

from tests.support.st_words import RESERVED

GRAMMAR = r"""
start: "FUNCTION_BLOCK" NAME section* statements "END_FUNCTION_BLOCK"
section: "VAR_INPUT" (declared ";")+ "END_VAR"
       | "VAR_OUTPUT" (declared ";")+ "END_VAR"
       | "VAR" (declared ";")+ "END_VAR"
       | "VAR" "CONSTANT" (declared ";")+ "END_VAR"
declared: NAME ("," NAME)* ":" (kind (":=" constant)? | array (":=" "[" constant ("," constant)* "]")?)
array: "ARRAY" "[" NUMBER ".." NUMBER "]" "OF" kind
kind: "DINT" | "UDINT" | "BOOL"
constant: "-"? NUMBER | "TRUE" | "FALSE"
statements: (statement ";")+
statement: variable ":=" expression
         | "IF" expression "THEN" statements ("ELSIF" expression "THEN" statements)* ("ELSE" statements)? "END_IF"
         | "FOR" NAME ":=" expression "TO" expression ("BY" expression)? "DO" statements "END_FOR"
variable: NAME ("[" expression "]")?
?expression: (expression "OR")? xor
?xor: (xor "XOR")? conjunction
?conjunction: (conjunction ("AND" | "&"))? comparison
?comparison: (comparison ("=" | "<>"))? ordered
?ordered: (ordered ("<" | ">" | "<=" | ">="))? sum
?sum: (sum ("+" | "-"))? term
?term: (term ("*" | "/" | "MOD"))? unary
?unary: ("-" | "NOT")? primary
?primary: NUMBER | "TRUE" | "FALSE" | variable | "(" expression ")" | FUNCTION "(" expression ("," expression)* ")"
FUNCTION: "SEL" | "MIN" | "MAX" | "ABS" | "BOOL_TO_DINT" | "DINT_TO_UDINT" | "UDINT_TO_DINT"
NAME: /(?!(?:%s|[A-Z]+_TO_[A-Z]+)\b)[A-Za-z](?:_?[A-Za-z0-9])*(?![A-Za-z0-9_])/i
NUMBER: /[0-9]+(?![A-Za-z0-9_#.]|\.[0-9])|[0-9]+(?=\.\.)/
COMMENT: /\(\*(?:(?!\(\*)[\s\S])*?\*\)/
%%ignore COMMENT
%%ignore /[ \t\r\n]+/
"""


@cache
def grammar() -> Lark:
    """Return the parser."""
    return Lark(GRAMMAR % "|".join(sorted(RESERVED, key=len, reverse=True)), parser="lalr")
