"""Small workbooks of Excel."""

import io
import zipfile
from xml.sax.saxutils import escape


def workbook(*sheets: list[list[object]]) -> bytes:
    """Return the bytes of a small .xlsx; numbers as numbers, other values as texts."""
    found = io.BytesIO()
    main = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
    document = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
    package = "http://schemas.openxmlformats.org/package/2006/relationships"
    types = "http://schemas.openxmlformats.org/package/2006/content-types"

    def cell(value: object) -> str:
        if isinstance(value, int | float):
            return f"<c><v>{value}</v></c>"
        return f'<c t="inlineStr"><is><t>{escape(str(value))}</t></is></c>'

    with zipfile.ZipFile(found, "w") as book:
        names = [f"S{i + 1}" for i in range(len(sheets))]
        listed = "".join(
            f'<sheet name="{name}" sheetId="{i + 1}" r:id="r{i}"/>' for i, name in enumerate(names)
        )
        book.writestr(
            "xl/workbook.xml",
            f'<workbook xmlns="{main}" xmlns:r="{document}"><sheets>{listed}</sheets></workbook>',
        )
        links = "".join(
            f'<Relationship Id="r{i}" Type="{document}/worksheet" Target="worksheets/{name}.xml"/>'
            for i, name in enumerate(names)
        )
        relations = f'<Relationships xmlns="{package}">{links}</Relationships>'
        book.writestr("xl/_rels/workbook.xml.rels", relations)
        root = f'<Relationship Id="r0" Type="{document}/officeDocument" Target="xl/workbook.xml"/>'
        book.writestr("_rels/.rels", f'<Relationships xmlns="{package}">{root}</Relationships>')
        kind = "application/vnd.openxmlformats-officedocument.spreadsheetml"
        parts = [("workbook", "sheet.main"), *((f"worksheets/{n}", "worksheet") for n in names)]
        overrides = "".join(
            f'<Override PartName="/xl/{part}.xml" ContentType="{kind}.{end}+xml"/>'
            for part, end in parts
        )
        book.writestr("[Content_Types].xml", f'<Types xmlns="{types}">{overrides}</Types>')
        for name, rows in zip(names, sheets, strict=True):
            body = "".join(f"<row>{''.join(map(cell, row))}</row>" for row in rows)
            book.writestr(
                f"xl/worksheets/{name}.xml",
                f'<worksheet xmlns="{main}"><sheetData>{body}</sheetData></worksheet>',
            )
    return found.getvalue()
