-- description: What a person calls the function of a callback. A Python function has its module in
--     front, a C++ function arguments and template parameters, one within the other. Of a bound
--     method C++ keeps only the class, of a lambda where it stands: NULL.
-- param: symbol VARCHAR  Function registered for it
CREATE OR REPLACE MACRO derive.function_name(symbol) AS
CASE
    WHEN contains(symbol, '<lambda>') THEN NULL
    WHEN regexp_matches(symbol, '^[^\s:(<]+:[^:]')
        THEN replace(regexp_replace(symbol, '^[^:]*:', ''), '.<locals>', '')
    WHEN NOT regexp_matches(symbol, '::\*|\{lambda') THEN nullif(trim(list_reduce(
        [symbol, '', '', ''],
        lambda name, _: regexp_replace(name, '\([^()]*\)|<[^<>]*>', '', 'g')
    )), '')
END
