"""Reads MaterialX documents, validates them, and generates a shader of each material; prints how many there are, a line a document."""

import sys

import MaterialX as mx
import MaterialX.PyMaterialXGenGlsl as glsl
import MaterialX.PyMaterialXGenShader as shader_generation

library = mx.createDocument()
mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), library)
for path in sys.argv[1:]:
    document = mx.createDocument()
    mx.readFromXmlFile(document, path)
    document.importLibrary(library)
    valid, message = document.validate()
    assert valid, message
    materials = document.getMaterialNodes()
    for material in materials:
        (shader,) = mx.getShaderNodes(material)
        assert shader.getCategory() == "disney_principled" and shader.getNodeDef() is not None
        generator = glsl.GlslShaderGenerator.create()
        context = shader_generation.GenContext(generator)
        context.registerSourceCodeSearchPath(mx.getDefaultDataSearchPath())
        generated = generator.generate(material.getName(), shader, context)
        assert "disney_principled" in generated.getSourceCode("pixel")
    print(len(materials))
