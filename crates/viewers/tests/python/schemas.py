"""Samples against the schemas of their channels."""

import functools
import json

import jsonschema


@functools.lru_cache(maxsize=None)
def validator(text):
    return jsonschema.Draft202012Validator(without_names(json.loads(text)))


def without_names(schema):
    """`oneOf` lists the names of numbers for viewers; numbers without a name may occur."""
    if isinstance(schema, dict):
        return {key: without_names(value) for key, value in schema.items() if key != "oneOf"}
    return schema


def check(sample, schema):
    """Raises an exception if the sample does not fit, or has fields that the schema does not name."""
    validator(schema).validate(sample)
    names_are_known(sample, json.loads(schema))


def names_are_known(sample, schema):
    if isinstance(sample, dict):
        for name, member in sample.items():
            assert name in schema["properties"], f"{name} is not in {schema}"
            names_are_known(member, schema["properties"][name])
    if isinstance(sample, list):
        for element in sample:
            names_are_known(element, schema["items"])
