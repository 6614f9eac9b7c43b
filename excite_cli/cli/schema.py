"""`excite schema`: the JSON Schema of the YAML problem, for editors."""


def schema() -> None:
    """Print the JSON Schema of the config; editors complete and check from it.

    Example:  excite schema > excite.schema.json
    """
    import json

    from excite_cli.config.spec import Spec

    print(json.dumps(Spec.model_json_schema(), indent=2, ensure_ascii=False))
