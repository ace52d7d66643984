<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<!-- Flow directions by ESRI's codes of D8, in hues around the compass. -->
<qgis version="3.22.0" styleCategories="Symbology">
  <pipe>
    <provider>
      <resampling enabled="true" zoomedInResamplingMethod="nearestNeighbour" zoomedOutResamplingMethod="nearestNeighbour" maxOversampling="2"/>
    </provider>
    <rasterrenderer type="paletted" band="1" opacity="1" alphaBand="-1" nodataColor="">
      <rasterTransparency/>
      <colorPalette>
        <paletteEntry value="0" label="outlet or sink" color="#141414" alpha="255"/>
        <paletteEntry value="1" label="east" color="#f0d246" alpha="255"/>
        <paletteEntry value="2" label="south-east" color="#ee993e" alpha="255"/>
        <paletteEntry value="4" label="south" color="#d45248" alpha="255"/>
        <paletteEntry value="8" label="south-west" color="#b04a8c" alpha="255"/>
        <paletteEntry value="16" label="west" color="#6854ac" alpha="255"/>
        <paletteEntry value="32" label="north-west" color="#3e7ac4" alpha="255"/>
        <paletteEntry value="64" label="north" color="#3caab0" alpha="255"/>
        <paletteEntry value="128" label="north-east" color="#8ec65c" alpha="255"/>
      </colorPalette>
    </rasterrenderer>
    <brightnesscontrast brightness="0" contrast="0" gamma="1"/>
    <huesaturation saturation="0" grayscaleMode="0" colorizeOn="0"/>
    <rasterresampler maxOversampling="2"/>
    <resamplingStage>provider</resamplingStage>
  </pipe>
  <blendMode>0</blendMode>
</qgis>
